#include "bindings.hpp"

NB_MODULE(KERNELS, m) {
    nanobind::set_leak_warnings(false);  // the process ends without a search for cycles
    m.doc() = "flexcal's C++ kernels";
#if defined(__x86_64__)
    m.attr("avx2") = static_cast<bool>(__builtin_cpu_supports("avx2"));
#else
    m.attr("avx2") = false;
#endif
    bind_closed_loop(m);
    bind_frequency(m);
    bind_geared_loop(m);
    bind_linear_algebra(m);
    bind_runtime(m);
    bind_tree(m);
    bind_triangle(m);
}
