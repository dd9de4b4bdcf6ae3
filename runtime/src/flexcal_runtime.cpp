#include "flexcal_runtime.h"

#include <algorithm>
#include <new>

#include "flexcal/runtime.hpp"

using flexcal::runtime::Model;
using flexcal::runtime::Pose;
using flexcal::runtime::Solver;
using flexcal::runtime::Status;

struct flexcal_model {
    std::unique_ptr<const Model> model;
};

struct flexcal_solver {
    Solver solver;
    explicit flexcal_solver(const Model& model) : solver(model) {}
};

namespace {

flexcal_model* opened(std::unique_ptr<const Model> model, const std::string& problem, char* error, size_t size) {
    if (error && size) {
        const size_t length = std::min(problem.size(), size - 1);
        std::copy_n(problem.data(), length, error);
        error[length] = 0;
    }
    return model ? new (std::nothrow) flexcal_model{std::move(model)} : nullptr;
}

int written(Status status, const Pose& pose, double* position, double* rotation) {
    if (status == Status::ok) {
        std::copy(pose.position, pose.position + 3, position);
        std::copy(pose.rotation, pose.rotation + 9, rotation);
    }
    return static_cast<int>(status);
}

}  // namespace

extern "C" {

flexcal_model* flexcal_model_read_file(const char* path, char* error, size_t size) {
    std::string problem;
    auto model = flexcal::runtime::read_model_file(path, problem);
    return opened(std::move(model), problem, error, size);
}

flexcal_model* flexcal_model_read(const char* text, size_t length, char* error, size_t size) {
    std::string problem;
    auto model = flexcal::runtime::read_model({text, length}, problem);
    return opened(std::move(model), problem, error, size);
}

void flexcal_model_free(flexcal_model* model) { delete model; }

int flexcal_model_joints(const flexcal_model* model) { return model->model->size(); }

const char* flexcal_model_joint_name(const flexcal_model* model, int joint) {
    return joint < 0 || joint >= model->model->size() ? nullptr : model->model->joints[static_cast<size_t>(joint)].name.c_str();
}

int flexcal_model_point(const flexcal_model* model, const char* name) { return model->model->point(name); }

int flexcal_beyond(const flexcal_model* model, const double* q, int point) { return model->model->beyond(q, point); }

flexcal_solver* flexcal_solver_new(const flexcal_model* model) { return new (std::nothrow) flexcal_solver(*model->model); }

void flexcal_solver_free(flexcal_solver* solver) { delete solver; }

int flexcal_set_payload(flexcal_solver* solver, double mass) { return static_cast<int>(solver->solver.set_payload(mass)); }

void flexcal_set_largest_correction(flexcal_solver* solver, double distance) { solver->solver.set_largest_correction(distance); }

int flexcal_forward(flexcal_solver* solver, const double* q, int point, const double* flank, double* position, double* rotation) {
    Pose pose;
    const Status status = solver->solver.forward(q, point, pose, flank);
    return written(status, pose, position, rotation);
}

int flexcal_nominal(flexcal_solver* solver, const double* q, int point, double* position, double* rotation) {
    Pose pose;
    const Status status = solver->solver.nominal(q, point, pose);
    return written(status, pose, position, rotation);
}

int flexcal_compensate(flexcal_solver* solver, const double* q, int point, double* command) {
    return static_cast<int>(solver->solver.compensate(q, point, command));
}

int flexcal_inverse(flexcal_solver* solver, const double* position, const double* rotation, const double* near, int point, double* command) {
    Pose pose;
    std::copy(position, position + 3, pose.position);
    std::copy(rotation, rotation + 9, pose.rotation);
    return static_cast<int>(solver->solver.inverse(pose, near, point, command));
}

int flexcal_torque(flexcal_solver* solver, const double* q, const double* dq, const double* ddq, int elastic, double* torque) {
    return static_cast<int>(solver->solver.torque(q, dq, ddq, torque, elastic != 0));
}

int flexcal_joint(const flexcal_solver* solver) { return solver->solver.joint(); }

const char* flexcal_describe(int status) { return flexcal::runtime::describe(static_cast<Status>(status)); }

}  // extern "C"
