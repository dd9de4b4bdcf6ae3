#include "bindings.hpp"

NB_MODULE(_kernels, m) {
    m.doc() = "flexcal's C++ kernels";
    bind_closed_loop(m);
    bind_tree(m);
}
