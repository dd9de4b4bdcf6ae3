"""A plugin of pytest that takes the kernels from another build: that of `make sanitize`, in the folder SANITIZED_KERNELS."""

from __future__ import annotations

import os
import sys
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

for _name in ("_kernels", "_kernels_avx2"):
    for _path in Path(os.environ["SANITIZED_KERNELS"]).glob(f"{_name}.*.so"):
        _spec = spec_from_file_location(f"flexcal.{_name}", _path)
        assert isinstance(_spec, ModuleSpec) and _spec.loader is not None
        sys.modules[_spec.name] = module_from_spec(_spec)
        _spec.loader.exec_module(sys.modules[_spec.name])
