// Joint positions in, commands out, a JSON document a line: for every language that can write to a pipe.
//
//   command_filter robot.json < positions > commands
//
//   {"q": [0, -0.5, 1.6, 0, 0.6, 0]}                       a line in, with "point" and "payload" (kg) where they change
//   {"status": "done", "command": [ ... ]}                 the line out, with "beyond": true where the calibration may not hold
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "flexcal/runtime.hpp"

namespace {

using flexcal::runtime::Json;
using flexcal::runtime::JsonReader;
using flexcal::runtime::Status;

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return result + "\"";
}

class Filter {
  public:
    explicit Filter(const flexcal::runtime::Model& model) : model_(model), solver_(model), q_(model.joints.size()), command_(q_.size()) {}

    std::string answer(const std::string& line) {
        Json asked;
        std::string error;
        if (!JsonReader(line).read(asked, error)) return problem(error);
        if (!take(asked, error)) return problem(error);
        const Status status = solver_.compensate(q_.data(), point_, command_.data());
        if (status != Status::ok) {
            const int joint = solver_.joint();
            return problem(std::string(flexcal::runtime::describe(status)) +
                           (joint < 0 ? "" : " (" + model_.joints[static_cast<std::size_t>(joint)].name + ")"));
        }
        std::string text;
        for (const double value : command_) {
            char number[32];
            std::snprintf(number, sizeof number, "%.17g", value);
            text += (text.empty() ? "" : ", ") + std::string(number);
        }
        return "{\"status\": \"done\", \"command\": [" + text + (model_.beyond(q_.data(), point_) ? "], \"beyond\": true}" : "]}");
    }

  private:
    static std::string problem(const std::string& sentence) { return "{\"status\": " + quoted(sentence) + "}"; }

    bool take(const Json& asked, std::string& error) {
        const Json* q = asked.member("q");
        if (!q || q->kind != Json::Kind::list || q->items.size() != q_.size())
            return error = "\"q\" must be a list of " + std::to_string(q_.size()) + " numbers", false;
        for (std::size_t i = 0; i < q_.size(); ++i) {
            if (q->items[i].kind != Json::Kind::number) return error = "\"q\" must have numbers alone", false;
            q_[i] = q->items[i].number;
        }
        if (const Json* point = asked.member("point")) {
            const int found = point->kind == Json::Kind::text ? model_.point(point->text) : -1;
            if (found < 0) return error = "there is no such point", false;
            point_ = found;
        }
        if (const Json* payload = asked.member("payload"))
            if (payload->kind != Json::Kind::number || solver_.set_payload(payload->number) != Status::ok)
                return error = "\"payload\" must be a mass in kg, of a robot that declares a payload", false;
        return true;
    }

    const flexcal::runtime::Model& model_;
    flexcal::runtime::Solver solver_;
    std::vector<double> q_, command_;
    int point_ = 0;
};

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) return std::fprintf(stderr, "usage: command_filter robot.json < positions > commands\n"), 2;
    std::string error, line;
    const auto model = flexcal::runtime::read_model_file(arguments[1], error);
    if (!model) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
    Filter filter(*model);
    while (std::getline(std::cin, line)) std::cout << filter.answer(line) << std::endl;
}
