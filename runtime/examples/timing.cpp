// How long calls take on this machine: a million random postures, each far from the last, and a million along a path at 1 kHz.
//
//   timing robot.json [calls]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "flexcal/runtime.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using flexcal::runtime::Solver;
using flexcal::runtime::Status;

struct Range {
    double lower, upper;
};

double quantile(std::vector<float>& values, double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<double>(*at);
}

// Microseconds of every call of `call` at the positions that `place` gives.
template <class Place, class Call>
void measure(const char* name, std::size_t calls, std::size_t n, Place place, Call call) {
    std::vector<double> q(n);
    std::vector<float> took;
    took.reserve(calls);
    std::size_t failed = 0;
    for (std::size_t k = 0; k < calls; ++k) {
        place(k, q.data());
        const auto begun = Clock::now();
        failed += call(q.data()) != Status::ok;
        took.push_back(std::chrono::duration<float, std::micro>(Clock::now() - begun).count());
    }
    std::printf("%-20s median %.2f p99 %.2f p99.99 %.2f most %.2f us, %zu of %zu without a result\n", name, quantile(took, 0.5),
                quantile(took, 0.99), quantile(took, 0.9999), quantile(took, 1.0), failed, calls);
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 2) return std::fprintf(stderr, "usage: timing robot.json [calls]\n"), 2;
    std::string error;
    const auto model = flexcal::runtime::read_model_file(arguments[1], error);
    if (!model) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
    const std::size_t n = model->joints.size();
    const std::size_t calls = count > 2 ? std::strtoul(arguments[2], nullptr, 10) : 1000000;
    if (calls == 0) return std::fprintf(stderr, "the calls must be a positive number\n"), 2;
    std::vector<Range> ranges;
    for (const auto& joint : model->joints) {
        const double lower = std::max(joint.lower, -3.14), upper = std::min(joint.upper, 3.14);
        ranges.push_back({lower + 0.02 * (upper - lower), upper - 0.02 * (upper - lower)});
    }
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    const auto anywhere = [&](std::size_t, double* q) {
        for (std::size_t j = 0; j < n; ++j) q[j] = ranges[j].lower + share(random) * (ranges[j].upper - ranges[j].lower);
    };
    const auto along = [&](std::size_t k, double* q) {
        for (std::size_t j = 0; j < n; ++j) {
            const auto [lower, upper] = ranges[j];
            q[j] = 0.5 * (lower + upper) + 0.4 * (upper - lower) * std::sin(1e-3 * (0.5 + 0.17 * static_cast<double>(j)) * static_cast<double>(k));
        }
    };
    Solver solver(*model);
    std::vector<double> command(n);
    flexcal::runtime::Pose pose;
    const auto forward = [&](const double* q) { return solver.forward(q, 0, pose); };
    const auto compensate = [&](const double* q) { return solver.compensate(q, 0, command.data()); };
    measure("forward, anywhere", calls, n, anywhere, forward);
    measure("forward, a path", calls, n, along, forward);
    measure("command, anywhere", calls, n, anywhere, compensate);
    measure("command, a path", calls, n, along, compensate);
}
