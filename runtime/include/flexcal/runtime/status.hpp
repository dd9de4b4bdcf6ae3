// What became of a call.
#pragma once

namespace flexcal::runtime {

enum class Status : int {
    ok = 0,
    bad_input = 1,    // a number that is not finite, a matrix that is no rotation, an unknown point, or a payload of a robot that declares none
    limit = 2,        // a joint would be past its limit
    singular = 3,     // the arm can hardly move its tool in the direction in which it would have to
    too_far = 4,      // the command would be farther from the given joint positions than a correction is
    not_reached = 5,  // the steps allowed did not bring the tool to its target
    unstable = 6,     // the springs cannot carry the arm
    overflow = 7,     // the result is too large for a number, of a model or joint positions that no robot has
};
constexpr int statuses = 8;

inline const char* describe(Status status) {
    switch (status) {
        case Status::ok: return "done";
        case Status::bad_input:
            return "a number is not finite, a matrix is no rotation, the point is unknown, or a robot that declares no payload has one";
        case Status::limit: return "a joint would be past its limit";
        case Status::singular: return "the arm can hardly move its tool in the direction in which it would have to";
        case Status::too_far: return "the command would be farther from the given joint positions than a correction is";
        case Status::not_reached: return "the steps allowed did not bring the tool to its target";
        case Status::unstable: return "the springs cannot carry the arm";
        case Status::overflow: return "the result is too large for a number, as the model or the joint positions are those of no robot";
    }
    return "unknown status";
}

}  // namespace flexcal::runtime
