// Python's view of the triangles of least squares.
#include "triangle.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "bindings.hpp"

namespace nb = nanobind;

namespace {

using Matrix = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void append(Matrix triangle, Matrix rows) {
    const std::size_t k = rows.shape(0);
    if (triangle.shape(0) != k || triangle.shape(1) != k) throw nb::value_error("triangle must be (k, k) for rows (k, m)");
    nb::gil_scoped_release release;
    flexcal::append(triangle.data(), rows.data(), static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(rows.shape(1)));
}

}  // namespace

void bind_triangle(nb::module_& m) {
    m.def("append", &append, nb::arg("triangle").noconvert(), nb::arg("rows").noconvert(),
          "Bring rows (k, m), column by column, into the upper triangle (k, k) of a QR, in place; the rows are spent.");
}
