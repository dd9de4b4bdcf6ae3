// Python's view of the triangles of least squares.
#include "triangle.hpp"

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "bindings.hpp"

namespace nb = nanobind;

namespace {

void update(nb::handle triangle_, nb::handle rows_) {
    const flexcal::Rows rows(rows_, {flexcal::any, flexcal::any}, "rows");
    const std::size_t k = rows.shape(0);
    const auto triangle = flexcal::written_reals(triangle_, {k, k}, "triangle");
    nb::gil_scoped_release release;
    flexcal::update(triangle.data(), rows.data(), static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(rows.shape(1)), rows.stride());
}

}  // namespace

void bind_triangle(nb::module_& m) {
    m.def("update", &update, nb::arg("triangle"), nb::arg("rows"),
          "Bring rows (k, m), column by column, into the upper triangle (k, k) of a QR, in place.");
}
