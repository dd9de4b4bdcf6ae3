#include <nanobind/nanobind.h>

NB_MODULE(_kernels, m) { m.doc() = "flexcal's C++ kernels"; }
