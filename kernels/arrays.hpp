// NumPy arrays as the kernels take them: contiguous, of a given shape; what does not fit is refused in one sentence that names the array.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace flexcal {

namespace nb = nanobind;

template <class T, std::size_t axes>
using Contiguous = nb::ndarray<T, nb::ndim<axes>, nb::c_contig, nb::device::cpu>;

constexpr std::size_t any = static_cast<std::size_t>(-1);  // an extent that may be what it is

template <class Extent>
std::string shape_text(std::size_t axes, Extent&& extent) {
    std::string text = "(";
    for (std::size_t k = 0; k < axes; ++k)
        text += (k ? ", " : "") + (extent(k) == any ? std::string("any") : std::to_string(extent(k)));
    return text + (axes == 1 ? ",)" : ")");
}

// `object` as an array of this shape. One that is read (const T) is converted where its kind or order differs, from real numbers only;
// one that is written has to be what it should be.
template <class T, std::size_t axes, class Array = Contiguous<T, axes>>
Array array(nb::handle object, const std::size_t (&shape)[axes], const char* name) {
    constexpr bool read = std::is_const_v<T>, whole = std::is_integral_v<T>;
    const std::string what(name);
    nb::ndarray<nb::ro> raw;
    if (!nb::try_cast(object, raw, false)) throw nb::type_error((what + " must be a NumPy array of numbers").c_str());
    const auto kind = static_cast<nb::dlpack::dtype_code>(raw.dtype().code);
    if (kind != nb::dlpack::dtype_code::Int && kind != nb::dlpack::dtype_code::UInt && (whole || kind != nb::dlpack::dtype_code::Float))
        throw nb::type_error((what + " must be an array of " + (whole ? "whole" : "real") + " numbers").c_str());
    bool fits = raw.ndim() == axes;
    for (std::size_t k = 0; fits && k < axes; ++k) fits = shape[k] == any || raw.shape(k) == shape[k];
    if (!fits) {
        const std::string expected = shape_text(axes, [&](std::size_t k) { return shape[k]; });
        const std::string present = shape_text(raw.ndim(), [&](std::size_t k) { return raw.shape(k); });
        throw nb::value_error((what + " must have the shape " + expected + ", not " + present).c_str());
    }
    Array taken;
    if (!nb::try_cast(object, taken, read)) throw nb::type_error((what + " must be a writable C-contiguous array of float64").c_str());
    return taken;
}

template <std::size_t axes>
Contiguous<const double, axes> reals(nb::handle object, const std::size_t (&shape)[axes], const char* name) {
    return array<const double>(object, shape, name);
}
template <std::size_t axes>
Contiguous<const std::int64_t, axes> indices(nb::handle object, const std::size_t (&shape)[axes], const char* name) {
    return array<const std::int64_t>(object, shape, name);
}
template <std::size_t axes>
Contiguous<double, axes> written_reals(nb::handle object, const std::size_t (&shape)[axes], const char* name) {
    return array<double>(object, shape, name);
}

// A matrix to be read whose rows are contiguous, and need not follow each other.
struct Rows {
    using Strided = nb::ndarray<const double, nb::ndim<2>, nb::device::cpu>;

    Rows(nb::handle object, const std::size_t (&shape)[2], const char* name) : matrix_(array<const double, 2, Strided>(object, shape, name)) {
        if (matrix_.shape(1) > 1 && matrix_.stride(1) != 1) matrix_ = Strided(reals(object, shape, name));
    }
    std::size_t shape(std::size_t axis) const { return matrix_.shape(axis); }
    std::ptrdiff_t stride() const { return matrix_.stride(0); }
    const double* data() const { return matrix_.data(); }

  private:
    Strided matrix_;
};

using Result = nb::ndarray<nb::numpy, double>;

// An array to be returned.
struct Buffer {
    std::unique_ptr<double[]> data;
    std::vector<std::size_t> shape;

    explicit Buffer(std::vector<std::size_t> extents) : shape(std::move(extents)) {
        std::size_t size = 1;
        for (std::size_t e : shape) size *= e;
        data = std::make_unique<double[]>(size);
    }
    Result release() {
        double* p = data.release();
        nb::capsule owner(p, [](void* q) noexcept { delete[] static_cast<double*>(q); });
        return Result(p, shape.size(), shape.data(), owner);
    }
};

}  // namespace flexcal
