// Fuzzing of the runtime: every model that is read has a finite result or a status for every call, and nothing is written with the latter.
//
//   runtime_fuzzer FOLDER [COUNT]    every file of the folder, and COUNT mutations of each, the same ones every time
//
// For libFuzzer: clang++ -fsanitize=fuzzer,address,undefined -DLIBFUZZER …, which has a main of its own.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <flexcal/runtime.hpp>

namespace {

using namespace flexcal::runtime;
using Random = std::mt19937;

constexpr int rounds = 8;
constexpr double untouched = 12345.678;

long models = 0, refusals = 0, calls[statuses] = {};

[[noreturn]] void stop(std::string_view text, const char* call, const char* problem) {
    std::fprintf(stderr, "%s: %s, with the model\n%.*s\n", call, problem, static_cast<int>(text.size()), text.data());
    std::abort();
}

void check(std::string_view text, const char* call, Status status, const double* values, std::size_t count) {
    ++calls[static_cast<int>(status)];
    const bool ok = status == Status::ok;
    for (std::size_t i = 0; i < count; ++i)
        if (ok ? !std::isfinite(values[i]) : values[i] != untouched) stop(text, call, ok ? "a number is not finite" : "written without a result");
}

// A joint's position, speed or acceleration, or a payload: mostly such as robots have.
double drawn(Random& random) {
    static constexpr double odd[] = {0, -0.0, 1e-320, 0.2, 1e5, -1e20, 1e200, 1e308, -1e308, HUGE_VAL, NAN, 3.14159265358979};
    return random() % 60 ? std::uniform_real_distribution<double>(-3, 3)(random) : odd[random() % std::size(odd)];
}

void use(std::string_view text, Random& random) {
    std::string error;
    const auto model = read_model(text, error);
    if (!model) {
        ++refusals;
        if (error.empty()) stop(text, "read_model", "refused without a sentence");
        return;
    }
    ++models;
    Solver solver(*model);
    const std::size_t n = model->joints.size();
    std::vector<double> q(n), dq(n), ddq(n), flank(n), result(n);
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t i = 0; i < n; ++i) q[i] = drawn(random), dq[i] = drawn(random), ddq[i] = drawn(random), flank[i] = random() % 2 ? 1 : -1;
        const std::size_t points = model->points.size();
        const int point = static_cast<int>(random() % 20 ? random() % points : points);
        (void)solver.set_payload(drawn(random));
        (void)model->beyond(q.data(), point);
        Pose pose;
        const auto place = [&](const char* call, auto locate) {
            std::fill(pose.position, pose.position + 3, untouched), std::fill(pose.rotation, pose.rotation + 9, untouched);
            const Status status = locate();
            check(text, call, status, pose.position, 3), check(text, call, status, pose.rotation, 9);
            if (status == Status::ok && !(flexcal::departure_from_rotation(flexcal::rotation(pose.rotation)) < 1e-6)) stop(text, call, "no rotation");
        };
        const auto numbers = [&](const char* call, auto compute) {
            std::fill(result.begin(), result.end(), untouched);
            check(text, call, compute(), result.data(), n);
        };
        place("nominal", [&] { return solver.nominal(q.data(), point, pose); });
        place("forward on flanks", [&] { return solver.forward(q.data(), point, pose, flank.data()); });
        place("forward", [&] { return solver.forward(q.data(), point, pose); });
        if (random() % 5 == 0) pose.rotation[random() % 9] += drawn(random);
        numbers("inverse", [&] { return solver.inverse(pose, q.data(), point, result.data()); });
        numbers("compensate", [&] { return solver.compensate(q.data(), point, result.data()); });
        numbers("torque", [&] { return solver.torque(q.data(), dq.data(), ddq.data(), result.data()); });
        numbers("elastic torque", [&] { return solver.torque(q.data(), dq.data(), ddq.data(), result.data(), true); });
    }
}

// The text with a few numbers, bytes or spans changed.
std::string mutated(std::string text, Random& random) {
    static const char* const odd[] = {"0",    "-0.0",  "1",    "-1",   "2.5",   "6",     "1e-300", "1e-20", "-1e-3", "-1e6", "1e12",
                                      "1e19", "-1e20", "1e21", "1e50", "-1e50", "1e300", "1e999",  "null",  "[]",    "{}",   "true"};
    constexpr std::string_view of_numbers = "0123456789.eE+-";
    for (int changes = 1 + static_cast<int>(random() % 2); changes > 0 && !text.empty(); --changes) {
        const std::size_t at = random() % text.size(), most = text.size() - at;
        const unsigned kind = random() % 20;
        if (kind == 0) text[at] = static_cast<char>(random() % 256);
        if (kind == 1) text.erase(at, random() % std::min<std::size_t>(most, 40) + 1);
        if (kind == 2) text.insert(at, text.substr(at, random() % std::min<std::size_t>(most, 200)));
        if (kind == 3 && random() % 4 == 0) text.resize(at);
        if (kind < 4) continue;
        const std::size_t first = text.find_first_of("0123456789-", at);
        if (first == std::string::npos) continue;
        const std::size_t end = std::min(text.find_first_not_of(of_numbers, first), text.size());
        const std::size_t begin = text.find_last_not_of(of_numbers, first) + 1;
        text.replace(begin, end - begin, odd[random() % std::size(odd)]);
    }
    return text;
}

}  // namespace

#ifdef LIBFUZZER

extern "C" std::size_t LLVMFuzzerMutate(unsigned char* data, std::size_t size, std::size_t most);

extern "C" std::size_t LLVMFuzzerCustomMutator(unsigned char* data, std::size_t size, std::size_t most, unsigned seed) {
    Random random(seed);
    if (random() % 4 == 0) return LLVMFuzzerMutate(data, size, most);
    const std::string text = mutated({reinterpret_cast<const char*>(data), size}, random);
    std::memcpy(data, text.data(), std::min(text.size(), most));
    return std::min(text.size(), most);
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    Random random(1);
    use({reinterpret_cast<const char*>(data), size}, random);
    return 0;
}

#else

int main(int count, char** arguments) {
    if (count < 2) return std::fprintf(stderr, "usage: runtime_fuzzer FOLDER [COUNT]\n"), 2;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(arguments[1])) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    Random random(1);
    for (const auto& path : files) {
        std::ifstream file(path, std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(file), {}};
        use(text, random);
        for (long k = count > 2 ? std::atol(arguments[2]) : 0; k > 0; --k) use(mutated(text, random), random);
    }
    long all = 0;
    for (const long each : calls) all += each;
    std::printf("%zu files: %ld models refused, %ld read, %ld calls\n", files.size(), refusals, models, all);
    for (int status = 0; status < statuses; ++status) std::printf("%9ld: %s\n", calls[status], describe(static_cast<Status>(status)));
    return files.empty() || calls[0] == 0;
}

#endif
