"""The C++ kernels, in the build for this processor; all builds give bitwise identical results."""

from __future__ import annotations

from flexcal import _kernels

if _kernels.avx2:
    from flexcal._kernels_avx2 import Tree, append, closed_loop
else:
    from flexcal._kernels import Tree, append, closed_loop

__all__ = ["Tree", "append", "closed_loop"]
