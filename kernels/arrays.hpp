// NumPy arrays as the kernels take them: contiguous doubles that are read, state and logs that are written.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace flexcal {

namespace nb = nanobind;

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using State = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Log = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <typename Array>
void require_shape(const Array& array, std::size_t rows, std::size_t columns, const char* name) {
    if (array.shape(0) != rows || array.shape(1) != columns)
        throw std::invalid_argument(std::string(name) + " has the wrong shape");
}

}  // namespace flexcal
