"""The C++ kernels, in the build for this processor; all builds give bitwise identical results."""

from __future__ import annotations

from flexcal import _kernels

if _kernels.avx2:
    from flexcal._kernels_avx2 import (
        RuntimeRobot,
        Tree,
        add_selected,
        closed_loop,
        scatter_covariance,
        triangular_inverse,
        update,
    )
else:
    from flexcal._kernels import (
        RuntimeRobot,
        Tree,
        add_selected,
        closed_loop,
        scatter_covariance,
        triangular_inverse,
        update,
    )

__all__ = [
    "RuntimeRobot",
    "Tree",
    "add_selected",
    "closed_loop",
    "scatter_covariance",
    "triangular_inverse",
    "update",
]
