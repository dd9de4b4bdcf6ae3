// Three-vectors and rotation matrices, small enough to live in registers.
#pragma once
#include <array>
#include <cmath>
#include <limits>

namespace flexcal {

// S itself, from which it is not deduced.
template <class S>
struct Plain {
    using type = S;
};

// S is double, or several samples side by side, for which these are specialised.
template <class S>
S cosine(S a);
template <class S>
S sine(S a);
template <class S>
S square_root(S a);
template <class S>
bool any_nonzero(S a);
template <class S>
bool all_positive(S a);
template <>
inline double cosine(double a) { return std::cos(a); }
template <>
inline double sine(double a) { return std::sin(a); }
template <>
inline double square_root(double a) { return std::sqrt(a); }
template <>
inline bool any_nonzero(double a) { return a != 0; }
template <>
inline bool all_positive(double a) { return a > 0; }

template <class S>
inline S broadcast(double a) { return S{} + a; }

template <class S>
struct Vector {
    S x, y, z;
};
using Vector3 = Vector<double>;

template <class S>
inline Vector<S> operator+(const Vector<S>& a, const Vector<S>& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class S>
inline Vector<S> operator-(const Vector<S>& a, const Vector<S>& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class S>
inline Vector<S> operator*(typename Plain<S>::type s, const Vector<S>& a) { return {s * a.x, s * a.y, s * a.z}; }
template <class S>
inline S dot(const Vector<S>& a, const Vector<S>& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class S>
inline Vector<S> cross(const Vector<S>& a, const Vector<S>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vector3 vector3(const double* p) { return {p[0], p[1], p[2]}; }

// A rotation as its three columns: the images of x, y and z.
template <class S>
struct RotationOf {
    Vector<S> x, y, z;
};
using Rotation = RotationOf<double>;

template <class S>
inline Vector<S> operator*(const RotationOf<S>& r, const Vector<S>& v) { return v.x * r.x + v.y * r.y + v.z * r.z; }
template <class S>
inline RotationOf<S> operator*(const RotationOf<S>& a, const RotationOf<S>& b) { return {a * b.x, a * b.y, a * b.z}; }
template <class S>
inline Vector<S> lift(Vector3 a) { return {broadcast<S>(a.x), broadcast<S>(a.y), broadcast<S>(a.z)}; }
template <class S>
inline RotationOf<S> lift(const Rotation& r) { return {lift<S>(r.x), lift<S>(r.y), lift<S>(r.z)}; }
inline Rotation identity() { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; }
template <class S>
inline RotationOf<S> transpose(const RotationOf<S>& r) {
    return {{r.x.x, r.y.x, r.z.x}, {r.x.y, r.y.y, r.z.y}, {r.x.z, r.y.z, r.z.z}};
}

// Row-major 3x3 array to columns.
inline Rotation rotation(const double* m) {
    return {{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}};
}

// r · R_z(angle), r · R_y(angle), r · R_x(angle): turns about an axis of the rotated frame itself.
template <class S>
inline void turn_z(RotationOf<S>& r, S c, S s) {
    const Vector<S> x = c * r.x + s * r.y;
    r.y = c * r.y - s * r.x;
    r.x = x;
}
template <class S>
inline void turn_z(RotationOf<S>& r, typename Plain<S>::type angle) { turn_z<S>(r, cosine<S>(angle), sine<S>(angle)); }
template <class S>
inline void turn_y(RotationOf<S>& r, typename Plain<S>::type angle) {
    const S c = cosine<S>(angle), s = sine<S>(angle);
    const Vector<S> z = c * r.z + s * r.x;
    r.x = c * r.x - s * r.z;
    r.z = z;
}
template <class S>
inline void turn_x(RotationOf<S>& r, typename Plain<S>::type angle) {
    const S c = cosine<S>(angle), s = sine<S>(angle);
    const Vector<S> y = c * r.y + s * r.z;
    r.z = c * r.z - s * r.y;
    r.y = y;
}

// Columns to a row-major 3x3 array.
inline void write_rows(const Rotation& r, double* m) {
    const Rotation t = transpose(r);
    const Vector3 rows[3] = {t.x, t.y, t.z};
    for (int k = 0; k < 3; ++k) m[3 * k] = rows[k].x, m[3 * k + 1] = rows[k].y, m[3 * k + 2] = rows[k].z;
}

// Largest entry of RᵀR - 1: 0 for a rotation, infinite where an entry is not finite.
inline double departure_from_rotation(const Rotation& r) {
    const Rotation square = transpose(r) * r;
    const Vector3 columns[3] = {square.x, square.y, square.z};
    double worst = 0;
    for (int i = 0; i < 3; ++i) {
        const double entries[3] = {columns[i].x, columns[i].y, columns[i].z};
        for (int k = 0; k < 3; ++k) {
            const double off = std::abs(entries[k] - (i == k));
            worst = std::isfinite(off) ? std::fmax(worst, off) : std::numeric_limits<double>::infinity();
        }
    }
    return worst;
}

// Rotation by an angle about a unit axis (Rodrigues).
inline Rotation about(Vector3 a, double angle) {
    const double c = std::cos(angle), s = std::sin(angle), d = 1 - c;
    return {{c + d * a.x * a.x, d * a.x * a.y + s * a.z, d * a.x * a.z - s * a.y},
            {d * a.x * a.y - s * a.z, c + d * a.y * a.y, d * a.y * a.z + s * a.x},
            {d * a.x * a.z + s * a.y, d * a.y * a.z - s * a.x, c + d * a.z * a.z}};
}

}  // namespace flexcal
