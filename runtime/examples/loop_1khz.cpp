// A loop of 1 kHz that compensates joint positions on their way to the motors, and how well it keeps its time.
//
//   loop_1khz robot.json [seconds]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "flexcal/runtime.hpp"

namespace {

using Clock = std::chrono::steady_clock;

double microseconds(Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

// The i-th smallest of many, in one ten thousandth.
double quantile(std::vector<double>& values, double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 2) return std::fprintf(stderr, "usage: loop_1khz robot.json [seconds]\n"), 2;
    std::string error;
    const auto model = flexcal::runtime::read_model_file(arguments[1], error);
    if (!model) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
    const std::size_t n = model->joints.size();
    const double seconds = count > 2 ? std::atof(arguments[2]) : 2.0;
    const std::size_t cycles = seconds > 0 && seconds < 1e5 ? static_cast<std::size_t>(1000 * seconds) : 0;
    if (cycles == 0) return std::fprintf(stderr, "the seconds must be a positive number\n"), 2;

    // everything that allocates comes before the loop
    flexcal::runtime::Solver solver(*model);
    std::vector<double> nominal(n), command(n), took, late;
    took.reserve(cycles), late.reserve(cycles);
    std::size_t became[flexcal::runtime::statuses] = {};  // how many cycles had each status

    auto next = Clock::now();
    for (std::size_t cycle = 0; cycle < cycles; ++cycle) {
        next += std::chrono::milliseconds(1);
        std::this_thread::sleep_until(next);
        const auto woken = Clock::now();
        const double t = 1e-3 * static_cast<double>(cycle);
        for (std::size_t j = 0; j < n; ++j) {
            const auto& joint = model->joints[j];
            const double lower = std::max(joint.lower, -2.0), upper = std::min(joint.upper, 2.0);
            nominal[j] = 0.5 * (lower + upper) + 0.3 * (upper - lower) * std::sin((0.3 + 0.1 * static_cast<double>(j)) * t);
        }
        // on any other status the last command stays: the robot holds, and the cause is told
        ++became[static_cast<int>(solver.compensate(nominal.data(), 0, command.data()))];
        // ... command goes to the motors here ...
        took.push_back(microseconds(Clock::now() - woken));
        late.push_back(microseconds(woken - next));
    }
    std::printf("%zu cycles\n", cycles);
    for (int status = 0; status < flexcal::runtime::statuses; ++status)
        if (became[status]) std::printf("%8zu: %s\n", became[status], flexcal::runtime::describe(static_cast<flexcal::runtime::Status>(status)));
    for (auto [name, values] : {std::pair{"compensation", &took}, std::pair{"wake-up after the deadline", &late}})
        std::printf("%-27s median %.1f us, 99.99 %% %.1f us, most %.1f us\n", name, quantile(*values, 0.5), quantile(*values, 0.9999),
                    quantile(*values, 1.0));
}
