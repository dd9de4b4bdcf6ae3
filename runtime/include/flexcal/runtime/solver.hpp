// Poses of the deflected tool, and the commands that bring it where it is to be.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "flexcal/runtime/arm_at_rest.hpp"
#include "flexcal/runtime/inverse_dynamics.hpp"

namespace flexcal::runtime {

struct Pose {
    double position[3];  // m, in the robot's base
    double rotation[9];  // from the point's frame to the base, row by row
};

// A robot's search for commands, with all memory it needs; one for each thread. The model must outlive it.
class Solver {
  public:
    explicit Solver(const Model& model)
        : model_(model), n_(model.size()), arm_(model), dynamics_(model), frames_(n_), still_(3 * n_, 0.0),
          jacobian_(rows_ * n_), square_(rows_ * rows_), right_(rows_), q_(n_), origin_(n_), flank_(n_), torque_(n_), held_(n_) {
        for (const PointData& point : model.points) paths_.push_back(model.tree.path(point.joint));
        payload_ = model.payload.mass;
    }

    Solver(const Solver&) = delete;
    Solver& operator=(const Solver&) = delete;

    // Payload, kg, as declared in robot.yaml and said in its files, from the next call on.
    [[nodiscard]] Status set_payload(double mass) {
        if (!(mass >= 0 && std::isfinite(mass)) || (mass > 0 && model_.payload.joint < 0)) return Status::bad_input;
        payload_ = mass * model_.payload.scale;
        return Status::ok;
    }

    // Farthest that a command may be from the joint positions it starts from, rad or m.
    void set_largest_correction(double distance) { largest_correction_ = distance; }

    // What the calls below compute is written only where the status is ok.

    // Where the real tool is with the motors at q (n,), rad or m; flank (n,), ±1, the sides of backlashes, else those set by gravity.
    [[nodiscard]] Status forward(const double* q, int point, Pose& pose, const double* flank = nullptr) {
        joint_ = -1;
        if (!finite(q) || !known(point)) return Status::bad_input;
        for (int i = 0; flank && i < n_; ++i)
            if (flank[i] != 1 && flank[i] != -1) return Status::bad_input;
        const Status status = arm_.settle(q, payload_, flank);
        if (status != Status::ok) return status;
        return write(place(model_.tree, model_.prepared, q, arm_.deflection(), point, model_.points[point].real), pose);
    }

    // Where the nominal robot has the point at q (n,), rad or m.
    [[nodiscard]] Status nominal(const double* q, int point, Pose& pose) {
        joint_ = -1;
        if (!finite(q) || !known(point)) return Status::bad_input;
        return write(nominal_place(q, point), pose);
    }

    // Torques (n,) of the motors, N m, that move the warm robot so: links, payload, rotors and friction. If elastic, links stand where the
    // drives' springs let them, for motions slow beside their resonances.
    [[nodiscard]] Status torque(const double* q, const double* dq, const double* ddq, double* result, bool elastic = false) {
        joint_ = -1;
        if (!finite(q) || !finite(dq) || !finite(ddq)) return Status::bad_input;
        dynamics_.torque(q, dq, ddq, payload_, elastic, torque_.data());
        if (!finite(torque_.data())) return Status::overflow;
        std::copy(torque_.begin(), torque_.end(), result);
        return Status::ok;
    }

    // Torque (n,) of every motor against gravity where the last call left the arm, N m. Of a joint with backlash near 0, the side is doubtful.
    const double* rest_torque() const { return arm_.torque(); }

    // The joint that the last status is about; -1 where it is about none.
    int joint() const { return joint_; }

    // Motor positions (n,), rad or m, with which the real tool stands where the nominal one would at q.
    [[nodiscard]] Status compensate(const double* q, int point, double* command) {
        joint_ = -1;
        if (!finite(q) || !known(point)) return Status::bad_input;
        const Hung aim = nominal_place(q, point);
        if (!finite(aim)) return Status::overflow;
        return search(aim, q, point, command);
    }

    // The same for a pose of the tool, from motor positions `near` (n,) within the limits. The rotation counts where the arm has six joints
    // before the point.
    [[nodiscard]] Status inverse(const Pose& target, const double* near, int point, double* command) {
        joint_ = -1;
        if (!finite(near) || !known(point) || !is_pose(target)) return Status::bad_input;
        return search({vector3(target.position), rotation(target.rotation)}, near, point, command);
    }

  private:
    static constexpr int rows_ = 6, most_steps = 20;
    static constexpr double there = 1e-12, damping = 1e-7, hardly = 5e-3;

    bool known(int point) const { return point >= 0 && point < static_cast<int>(model_.points.size()); }

    bool finite(const double* q) const {
        for (int i = 0; i < n_; ++i)
            if (!std::isfinite(q[i])) return false;
        return true;
    }

    static bool finite(Vector3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

    // One test instead of twelve: what is not finite stays so in a sum.
    static bool finite(const Hung& hung) { return finite(hung.position + hung.rotation.x + hung.rotation.y + hung.rotation.z); }

    static bool is_pose(const Pose& pose) {
        const Rotation r = rotation(pose.rotation);
        return finite(vector3(pose.position)) && departure_from_rotation(r) < 1e-6 && dot(cross(r.x, r.y), r.z) > 0;
    }

    static Status write(const Hung& placed, Pose& pose) {
        if (!finite(placed)) return Status::overflow;
        const Vector3 p = placed.position;
        pose.position[0] = p.x, pose.position[1] = p.y, pose.position[2] = p.z;
        write_rows(placed.rotation, pose.rotation);
        return Status::ok;
    }

    Hung place(const Tree& tree, const std::vector<Prepared>& prepared, const double* q, const double* deflection, int point, const Hung& hung) {
        const Frames* last = nullptr;
        for (int i : paths_[point]) {
            frames_[i] = tree.advance(i, prepared[i], last, q[i], deflection + 3 * i);
            last = &frames_[i];
        }
        return {last->origin + last->link * hung.position, last->link * hung.rotation};
    }

    Hung nominal_place(const double* q, int point) {
        return place(model_.nominal_tree, model_.nominal_prepared, q, still_.data(), point, model_.points[point].nominal);
    }

    // Vector of the rotation that turns `from` to `to`, in the base.
    static Vector3 turn_between(const Rotation& from, const Rotation& to) {
        const Vector3 sine = 0.5 * (cross(from.x, to.x) + cross(from.y, to.y) + cross(from.z, to.z));
        const double s = std::sqrt(dot(sine, sine)), c = 0.5 * (dot(from.x, to.x) + dot(from.y, to.y) + dot(from.z, to.z) - 1);
        const double angle = std::atan2(s, c);
        if (s > 1e-9) return (angle / s) * sine;
        return c > 0 ? sine : Vector3{angle, 0, 0};  // half a turn, whatever its axis
    }

    // Gauss-Newton steps from `near` to the nearest command, on the flank that gravity sets; see newton_search.py for what these decide.
    Status search(const Hung& aim, const double* near, int point, double* command) {
        joint_ = past_limit(near);
        if (joint_ >= 0) return Status::limit;
        std::copy(near, near + n_, q_.begin());
        std::copy(near, near + n_, origin_.begin());
        std::fill(held_.begin(), held_.end(), 0);
        const double* flank = nullptr;
        bool flanks_turned = false;
        for (int step = 0; step <= most_steps; ++step) {
            const Status status = arm_.settle(q_.data(), payload_, flank);
            if (status != Status::ok) return status;
            if (!flank) {
                std::copy(arm_.flank(), arm_.flank() + n_, flank_.begin());
                flank = flank_.data();
            }
            const Hung at = place(model_.tree, model_.prepared, q_.data(), arm_.deflection(), point, model_.points[point].real);
            if (!finite(at)) return Status::overflow;
            const double off = residual(aim, at, model_.points[point].rows);
            if (off < there) {
                if (!flanks_turned && arm_.turned()) {
                    flanks_turned = true;
                    for (int i = 0; i < n_; ++i) flank_[i] = sign(arm_.torque()[i]);
                    continue;
                }
                joint_ = past_limit(q_.data());
                if (joint_ < 0) return accept(near, command);
                if (!hold(joint_, point)) return Status::limit;
            }
            advance(at, point);
            joint_ = farthest(near);
            if (joint_ >= 0) return singular_ ? Status::singular : Status::too_far;
        }
        return singular_ ? Status::singular : Status::not_reached;
    }

    Status accept(const double* near, double* command) {
        joint_ = farthest(near);
        if (joint_ >= 0) return Status::too_far;
        std::copy(q_.begin(), q_.end(), command);
        return Status::ok;
    }

    int past_limit(const double* q) const {
        int worst = -1;
        double most = 0;
        for (int i = 0; i < n_; ++i) {
            const double beyond = std::max(model_.joints[i].lower - q[i], q[i] - model_.joints[i].upper);
            if (beyond > most) worst = i, most = beyond;
        }
        return worst;
    }

    int farthest(const double* near) const {
        int worst = -1;
        double most = largest_correction_;
        for (int i = 0; i < n_; ++i)
            if (!(std::abs(q_[i] - near[i]) <= most)) worst = i, most = std::abs(q_[i] - near[i]);
        return worst;
    }

    // Keeps a joint of a redundant arm at its limit, for the others to make up for it; false where none can be spared.
    bool hold(int joint, int point) {
        int others = 0;
        for (int i : paths_[point]) others += !held_[i];
        if (held_[joint] || others <= model_.points[point].rows) return false;
        held_[joint] = 1;
        origin_[joint] = std::min(std::max(q_[joint], model_.joints[joint].lower), model_.joints[joint].upper);
        return true;
    }

    double residual(const Hung& aim, const Hung& at, int rows) {
        const Vector3 away = aim.position - at.position, turn = rows == 6 ? turn_between(at.rotation, aim.rotation) : Vector3{0, 0, 0};
        const double all[rows_] = {away.x, away.y, away.z, turn.x, turn.y, turn.z};
        double worst = 0;
        for (int r = 0; r < rows_; ++r) {
            right_[r] = all[r];
            worst = std::max(worst, std::abs(all[r]));
        }
        return worst;
    }

    // q ← q₀ + J⁺ (r + J (q − q₀)), rotations counting as displacements at the distance of the reach.
    void advance(const Hung& at, int point) {
        const int rows = model_.points[point].rows;
        motion(at, point);
        for (int r = 0; r < rows; ++r)
            for (int j = 0; j < n_; ++j) right_[r] += jacobian_[r * n_ + j] * (q_[j] - origin_[j]);
        for (int r = 3; r < rows; ++r) {
            right_[r] *= model_.reach;
            for (int j = 0; j < n_; ++j) jacobian_[r * n_ + j] *= model_.reach;
        }
        for (int r = 0; r < rows; ++r) {
            for (int c = 0; c <= r; ++c) {
                double sum = 0;
                for (int j = 0; j < n_; ++j)
                    if (!held_[j]) sum += jacobian_[r * n_ + j] * jacobian_[c * n_ + j];
                square_[r * rows + c] = sum;
            }
            square_[r * rows + r] += damping * model_.reach * damping * model_.reach;
        }
        const bool factored = cholesky(square_, rows);
        double least = std::numeric_limits<double>::infinity();
        for (int r = 0; r < rows; ++r) least = std::min(least, square_[r * rows + r]);
        singular_ = !factored || least < hardly * model_.reach;
        if (factored) cholesky_solve(square_, rows, right_.data());
        for (int j = 0; j < n_; ++j) {
            double step = 0;
            for (int r = 0; r < rows && factored && !held_[j]; ++r) step += jacobian_[r * n_ + j] * right_[r];
            q_[j] = origin_[j] + step;
        }
    }

    // Jacobian (6, n) by the motors, of the arm as it stands: how its deflection changes on the way is left to the next step.
    void motion(const Hung& at, int point) {
        std::fill(jacobian_.begin(), jacobian_.end(), 0.0);
        for (int i : paths_[point]) {
            const Frames& f = frames_[i];
            const bool slides = model_.tree.joints[i].prismatic;
            const Vector3 linear = slides ? f.axis : cross(f.axis, at.position - f.origin), angular = slides ? Vector3{0, 0, 0} : f.axis;
            double ratio = 1;
            for (const Wave& wave : model_.joints[i].waves)
                ratio += wave.order * (wave.sine * std::cos(wave.order * q_[i]) - wave.cosine * std::sin(wave.order * q_[i]));
            add(i, ratio, linear, angular);
            for (const RatioError& error : model_.ratio_errors)
                if (error.joint == i) add(error.other, error.ratio, linear, angular);
        }
    }

    void add(int j, double share, Vector3 linear, Vector3 angular) {
        const double column[rows_] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
        for (int r = 0; r < rows_; ++r) jacobian_[r * n_ + j] += share * column[r];
    }

    const Model& model_;
    const int n_;
    ArmAtRest arm_;
    InverseDynamics dynamics_;
    std::vector<std::vector<int>> paths_;
    std::vector<Frames> frames_;
    const std::vector<double> still_;
    std::vector<double> jacobian_, square_, right_, q_, origin_, flank_, torque_;
    std::vector<char> held_;
    double payload_ = 0, largest_correction_ = 0.2;
    bool singular_ = false;
    int joint_ = -1;
};

}  // namespace flexcal::runtime
