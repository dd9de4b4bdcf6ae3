/* The runtime for C, and for every language that calls C. SI units: m, rad, kg, N m. No call but the two that make things allocates. */
#ifndef FLEXCAL_RUNTIME_H
#define FLEXCAL_RUNTIME_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum flexcal_status {
    FLEXCAL_OK = 0,
    FLEXCAL_BAD_INPUT = 1,   /* a number is not finite, a matrix is no rotation, the point is unknown, or a payload is not declared */
    FLEXCAL_LIMIT = 2,       /* a joint would be past its limit */
    FLEXCAL_SINGULAR = 3,    /* the arm can hardly move its tool in the direction in which it would have to */
    FLEXCAL_TOO_FAR = 4,     /* the command would be farther from the given joint positions than a correction is */
    FLEXCAL_NOT_REACHED = 5, /* the steps allowed did not bring the tool to its target */
    FLEXCAL_UNSTABLE = 6,    /* the springs cannot carry the arm */
    FLEXCAL_OVERFLOW = 7     /* the result is too large for a number, of a model or joint positions that no robot has */
};

/* A calibrated robot, constant: threads may share it. */
typedef struct flexcal_model flexcal_model;
/* A search with its memory; one for each thread. Its model must outlive it. */
typedef struct flexcal_solver flexcal_solver;

/* The robot in a file, or a text, of `flexcal export runtime`; null where it cannot be read, with a sentence in `error` (size bytes). */
flexcal_model* flexcal_model_read_file(const char* path, char* error, size_t size);
flexcal_model* flexcal_model_read(const char* text, size_t length, char* error, size_t size);
void flexcal_model_free(flexcal_model* model);

int flexcal_model_joints(const flexcal_model* model);
const char* flexcal_model_joint_name(const flexcal_model* model, int joint);
/* The index of a point by its name, -1 where there is none. */
int flexcal_model_point(const flexcal_model* model, const char* name);
/* 1 where q (n) lies outside the joint ranges within which the point's predicted error is not above three times that near the calibrated
   poses, a warning; 0 elsewhere, and where the calibration does not say it. */
int flexcal_beyond(const flexcal_model* model, const double* q, int point);

flexcal_solver* flexcal_solver_new(const flexcal_model* model);
void flexcal_solver_free(flexcal_solver* solver);

/* Payload, kg, from the next call on; before, the declared one. */
int flexcal_set_payload(flexcal_solver* solver, double mass);
/* Farthest that a command may be from the joint positions it starts from: 0.2 rad or m by default. */
void flexcal_set_largest_correction(flexcal_solver* solver, double distance);

/* What the calls below compute is written only where the status is FLEXCAL_OK. */
/* position (3), rotation (9, row by row) of a point with the motors at q; flank (n), +1 or -1, or null where gravity sets it. */
int flexcal_forward(flexcal_solver* solver, const double* q, int point, const double* flank, double* position, double* rotation);
/* The same of the nominal robot. */
int flexcal_nominal(flexcal_solver* solver, const double* q, int point, double* position, double* rotation);
/* Commands (n) with which the real tool stands where the nominal one would at q. */
int flexcal_compensate(flexcal_solver* solver, const double* q, int point, double* command);
/* Commands (n) for a pose, from motor positions near (n). */
int flexcal_inverse(flexcal_solver* solver, const double* position, const double* rotation, const double* near, int point, double* command);
/* Torques (n) of the motors, N m, that move the warm robot so: links, payload, rotors and friction. If elastic is not 0, links stand where
   the drives' springs let them, for motions slow beside their resonances. */
int flexcal_torque(flexcal_solver* solver, const double* q, const double* dq, const double* ddq, int elastic, double* torque);
/* The joint that the last status is about, -1 for none. */
int flexcal_joint(const flexcal_solver* solver);

const char* flexcal_describe(int status);

#ifdef __cplusplus
}
#endif

#endif
