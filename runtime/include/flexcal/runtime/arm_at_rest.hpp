// Where the arm comes to rest under gravity with its motors held: springs, backlash, compliances and transmission errors.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "flexcal/cholesky.hpp"
#include "flexcal/gravity_load.hpp"
#include "flexcal/runtime/model.hpp"
#include "flexcal/runtime/status.hpp"

namespace flexcal::runtime {

inline double sign(double a) { return static_cast<double>((a > 0) - (a < 0)); }

// Twist of a spring that hardens, k θ (1 + h (θ / 1 mrad)²) = torque, by Newton's method from its cube root.
inline double hardened_twist(double linear, double hardening) {
    constexpr double reference = 1e-3, small = 1e-15;
    if (hardening == 0) return linear;
    const auto square = [&](double twist) { return hardening * (twist / reference) * (twist / reference); };
    double twist = linear / std::cbrt(1 + square(linear));
    for (int i = 0; i < 20; ++i) {
        const double step = (twist * (1 + square(twist)) - linear) / (1 + 3 * square(twist));
        twist -= step;
        if (std::abs(step) <= small) break;
    }
    return twist;
}

class ArmAtRest {
  public:
    explicit ArmAtRest(const Model& model)
        : model_(model), n_(model.size()), d_(static_cast<int>(model.axes.size())), rigid_axes_(every_axis(model)),
          masses_{model.mass.data(), model.first_moment.data(), nullptr, model.payload.joint, model.payload.com},
          rigid_(model.tree, rigid_axes_, model.geometry.data(), masses_, model.gravity),
          elastic_(model.tree, model.axes, model.geometry.data(), masses_, model.gravity),
          still_(3 * n_, 0.0), bent_(3 * n_, 0.0), deflection_(3 * n_, 0.0), load_(n_), free_(n_), flank_(n_), torque_(n_), moved_(n_),
          factored_at_(n_, std::numeric_limits<double>::infinity()), hessian_(d_ * d_), step_(d_) {}

    // Tilt about x, tilt about y and twist of every joint (n, 3), rad; torque (n,) of its motor at rest, N m; side (n,) of its backlash.
    const double* deflection() const { return deflection_.data(); }
    const double* torque() const { return torque_.data(); }
    const double* flank() const { return flank_.data(); }

    // q: (n,); payload: true kg; flank: (n,), ±1, or null where the torque at rest decides.
    Status settle(const double* q, double payload, const double* flank) {
        rigid_loads(q, payload);
        if (flank)
            std::copy(flank, flank + n_, flank_.begin());
        else
            for (int i = 0; i < n_; ++i) flank_[i] = sign(load_[i]);
        for (int pass = 1;; ++pass) {
            double total = 0;
            for (int i = 0; i < n_; ++i) {
                moved_[i] = q[i] + free_[i] - flank_[i] * model_.joints[i].backlash;
                total += moved_[i];
            }
            if (!std::isfinite(total)) return Status::overflow;
            const Status status = solve(payload);
            if (status != Status::ok) return status;
            for (int i = 0; i < n_; ++i) {
                const double stiffness = model_.joints[i].drive_stiffness;
                torque_[i] = stiffness > 0 ? -stiffness * bent_[3 * i + 2] : load_[i];
            }
            if (flank || pass == most_passes || !turned()) break;
            for (int i = 0; i < n_; ++i) flank_[i] = sign(torque_[i]);
        }
        for (int i = 0; i < n_; ++i) {
            deflection_[3 * i] = bent_[3 * i] + lateral_tilt_[2 * i];
            deflection_[3 * i + 1] = bent_[3 * i + 1] + lateral_tilt_[2 * i + 1];
            deflection_[3 * i + 2] = bent_[3 * i + 2] + (moved_[i] - q[i]);
        }
        return Status::ok;
    }

    // Whether the torque at rest presses a joint with backlash to the other side than the one taken.
    bool turned() const {
        for (int i = 0; i < n_; ++i)
            if (model_.joints[i].backlash > 0 && sign(torque_[i]) != flank_[i]) return true;
        return false;
    }

  private:
    static constexpr int most_passes = 5, most_steps = 40, steps_of_one_factor = 8;
    static constexpr double still_enough = 1e-14, same_posture = 0.05;

    static std::vector<ElasticAxis> every_axis(const Model& model) {
        std::vector<ElasticAxis> axes;
        for (int i = 0; i < model.size(); ++i)
            if (!model.tree.joints[i].prismatic)
                for (int component : {2, 1, 0}) axes.push_back({i, component});
        return axes;
    }

    // What the undeflected arm's load does to joints: its torques, and twists and tilts beside those of springs.
    void rigid_loads(const double* q, double payload) {
        rigid_.move(q, still_.data(), payload);
        std::fill(load_.begin(), load_.end(), 0.0);
        for (std::size_t k = 0; k < rigid_axes_.size(); k += 3) {
            const int i = rigid_axes_[k].joint, at = static_cast<int>(k);
            const JointData& joint = model_.joints[i];
            load_[i] = -rigid_.load(at);
            lateral_tilt_[2 * i] = lateral_tilt_[2 * i + 1] = 0;
            if (joint.lateral_compliance[0] == 0 && joint.lateral_compliance[1] == 0) continue;
            const double motion = model_.tree.tilts_first ? 0.0 : q[i] + model_.prepared[i].offset;
            const double c = std::cos(motion), s = std::sin(motion), on_y = rigid_.load(at + 1), on_x = rigid_.load(at + 2);
            const Vector3 across[2] = {joint.lateral_1, joint.lateral_2};
            for (int side = 0; side < 2; ++side) {
                const double x = c * across[side].x + s * across[side].y, y = c * across[side].y - s * across[side].x;
                const double tilt = joint.lateral_compliance[side] * (x * on_x + y * on_y);
                lateral_tilt_[2 * i] += tilt * x, lateral_tilt_[2 * i + 1] += tilt * y;
            }
        }
        for (int i = 0; i < n_; ++i) {
            const JointData& joint = model_.joints[i];
            free_[i] = -load_[i] * joint.gravity_compliance;
            for (const Wave& wave : joint.waves) free_[i] += wave.sine * std::sin(wave.order * q[i]) + wave.cosine * std::cos(wave.order * q[i]);
            if (joint.hardening != 0) {
                const double linear = load_[i] / joint.drive_stiffness;
                free_[i] += linear - hardened_twist(linear, joint.hardening);
            }
        }
        for (const RatioError& error : model_.ratio_errors) free_[error.joint] += error.ratio * q[error.other];
    }

    // The springs' deflection for motors at `moved_`. One factor of the stiffness serves many steps: gravity's part of it, some hundredths,
    // hardly changes with a deflection of milliradians, nor in a posture nearby.
    Status solve(double payload) {
        if (d_ == 0) return Status::ok;
        double before = std::numeric_limits<double>::infinity();
        for (int k = 0; k < most_steps; ++k) {
            elastic_.move(moved_.data(), bent_.data(), payload);
            if (k > 0 ? k % steps_of_one_factor == 0 : !near_factor(payload)) {
                if (!factor(payload)) return forget(Status::unstable);
                before = std::numeric_limits<double>::infinity();
            }
            for (int j = 0; j < d_; ++j) step_[j] = elastic_.load(j) - model_.stiffness[j] * bent_[3 * model_.axes[j].joint + model_.axes[j].component];
            cholesky_solve(hessian_, d_, step_.data());
            double largest = 0, total = 0;
            for (int j = 0; j < d_; ++j) {
                bent_[3 * model_.axes[j].joint + model_.axes[j].component] += step_[j];
                largest = std::max(largest, std::abs(step_[j])), total += step_[j];
            }
            if (!std::isfinite(total)) return forget(Status::overflow);
            // the error after a step is that step times the ratio by which steps shrink
            if (largest < still_enough || (std::isfinite(before) && largest * std::min(1.0, largest / before) < still_enough)) return Status::ok;
            before = largest;
        }
        return forget(Status::unstable);
    }

    bool near_factor(double payload) const {
        if (payload != factored_with_) return false;
        for (int i = 0; i < n_; ++i)
            if (!(std::abs(moved_[i] - factored_at_[i]) < same_posture)) return false;
        return true;
    }

    bool factor(double payload) {
        for (int j = 0; j < d_; ++j) {
            for (int k = 0; k <= j; ++k) hessian_[j * d_ + k] = elastic_.stiffness(k, j);
            hessian_[j * d_ + j] += model_.stiffness[j];
        }
        std::copy(moved_.begin(), moved_.end(), factored_at_.begin());
        factored_with_ = payload;
        return cholesky(hessian_, d_);
    }

    Status forget(Status status) {
        std::fill(bent_.begin(), bent_.end(), 0.0);
        std::fill(factored_at_.begin(), factored_at_.end(), std::numeric_limits<double>::infinity());
        return status;
    }

    const Model& model_;
    const int n_, d_;
    const std::vector<ElasticAxis> rigid_axes_;  // twist, tilt_y and tilt_x of every revolute joint
    const Masses masses_;
    GravityLoad rigid_, elastic_;
    const std::vector<double> still_;
    std::vector<double> bent_;  // of the springs alone, kept as the start of the next search
    std::vector<double> deflection_, load_, free_, flank_, torque_, moved_, factored_at_;
    std::vector<double> lateral_tilt_ = std::vector<double>(2 * n_, 0.0);
    double factored_with_ = 0;
    std::vector<double> hessian_, step_;
};

}  // namespace flexcal::runtime
