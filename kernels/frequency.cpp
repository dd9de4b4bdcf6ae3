// Python's view of what measured frequency responses are made of. Complex numbers come and go as pairs of real ones, a last axis of two.
#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "scatter_covariance.hpp"

namespace nb = nanobind;
using namespace flexcal;

namespace {

void scatter_covariance(nb::handle white_, nb::handle right_, nb::handle left_, std::ptrdiff_t window, double freedom, nb::handle covariance_) {
    const auto white = reals(white_, {any, any, any, any, 2}, "white");
    const std::size_t lines = white.shape(0), m = white.shape(1), members = white.shape(2), n = white.shape(3);
    const auto right = reals(right_, {lines, n, n, 2}, "right");
    const auto left = reals(left_, {lines, m, m, 2}, "left");
    if (window < 1 || window > static_cast<std::ptrdiff_t>(lines)) throw nb::value_error("window must be between one and the number of lines");
    const auto covariance = written_reals(covariance_, {lines, m * n, m * n, 2}, "covariance");
    nb::gil_scoped_release release;
    const Scatter scatter{static_cast<std::ptrdiff_t>(lines), static_cast<int>(m), static_cast<int>(members), static_cast<int>(n),
                          white.data(), right.data(), left.data(), window, freedom};
    ScatterCovariance(scatter).fill(covariance.data());
}

}  // namespace

void bind_frequency(nb::module_& m) {
    m.def("scatter_covariance", &scatter_covariance, nb::arg("white"), nb::arg("right"), nb::arg("left"), nb::arg("window"), nb::arg("freedom"),
          nb::arg("covariance"),
          "Into covariance (L, m n, m n, 2) the covariance of vec from whitened scatter (L, m, R, n, 2), pooled over `window` lines, shrunk to its diagonal, and "
          "carried back by the lower triangles right (L, n, n, 2) and left (L, m, m, 2); the last axis is real and imaginary part.");
}
