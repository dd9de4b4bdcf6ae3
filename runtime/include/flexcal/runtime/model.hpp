// A calibrated robot as `flexcal export runtime` writes it, constant once it is read.
#pragma once
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "flexcal/gravity_load.hpp"
#include "flexcal/runtime/json.hpp"

namespace flexcal::runtime {

constexpr double largest_number = 1e20;                     // of a robot, in SI units; products of a few such numbers do not overflow
constexpr std::size_t most_joints = 100;
constexpr std::size_t largest_text = std::size_t{4} << 20;  // bytes

// Share of a joint's motion that its transmission adds: sine · sin(order q) + cosine · cos(order q), rad.
struct Wave {
    double order, sine, cosine;
};

// What a joint moves beyond what is declared per motion of another one, or of its own motor.
struct RatioError {
    int joint, other;
    double ratio;
};

struct JointData {
    std::string name;
    double lower, upper;  // rad or m, infinite where there is no limit
    double drive_stiffness = 0, hardening = 0;  // N m/rad, 0 where there is no spring; 1
    double backlash = 0;                        // half the gap, rad
    double gravity_compliance = 0;              // rad/(N m)
    double lateral_compliance[2] = {0, 0};      // about the axes of misalignment_1 and misalignment_2, rad/(N m)
    Vector3 lateral_1{0, 0, 0}, lateral_2{0, 0, 0};  // these axes, by their components along the tilt axes x and y
    std::vector<Wave> waves;
};

struct Hung {
    Vector3 position;  // m, in the joint's link
    Rotation rotation;
};

struct PointData {
    std::string name;
    int joint;
    int rows;  // 6 where its whole pose can be had, 3 where its position can
    Hung real, nominal;
    std::vector<double> lower, upper;  // joint ranges within which the calibration holds; empty where it does everywhere, or does not say
};

struct PayloadData {
    int joint = -1;
    Vector3 com{0, 0, 0};  // m, in the joint's link
    double mass = 0;       // kg, as declared
    double scale = 1;      // true mass per mass said
    double inertia[6] = {0, 0, 0, 0, 0, 0};  // of 1 kg about the link frame's origin, kg m²
};

// What a joint's motor gives beside what moves the links; N m, or N of a prismatic joint, referred to the joint.
struct DriveData {
    double inertia[6];  // of the link about its frame's origin: xx, xy, xz, yy, yz, zz, kg m²
    double rotor_inertia, viscous, coulomb, torque_offset;
    double coulomb_asymmetry, sublinear_viscous, presliding, stribeck, load_coulomb, load_stribeck;  // of the motor's axis
    double stribeck_velocity, load_stribeck_velocity;
    double spring_stiffness, spring_torque;
};

// Motors that also turn another joint: motor m turns at q_m + ratio q_j.
struct CouplingData {
    int motor, joint;
    double ratio, rotor_inertia, viscous, coulomb;
};

// Where every number of one robot stands. Threads share it; each has a Solver of its own.
struct Model {
    std::string robot;
    double reach = 0;  // m
    Vector3 gravity{0, 0, 0};
    Tree tree, nominal_tree;
    std::vector<Prepared> prepared, nominal_prepared;  // the trees with their errors
    std::vector<double> geometry, nominal_geometry;  // (n, 6)
    std::vector<JointData> joints;
    std::vector<RatioError> ratio_errors;
    std::vector<ElasticAxis> axes;  // from base to tool
    std::vector<double> stiffness;  // of the axes, N m/rad
    std::vector<double> mass, first_moment;  // (n,) kg, (n, 3) kg m
    std::vector<DriveData> drives;
    std::vector<CouplingData> couplings;
    std::vector<PointData> points;
    PayloadData payload;

    int size() const { return static_cast<int>(joints.size()); }

    // The index of a point; -1 where there is none of this name.
    int point(std::string_view name) const {
        for (std::size_t i = 0; i < points.size(); ++i)
            if (points[i].name == name) return static_cast<int>(i);
        return -1;
    }

    // Whether joint positions q (n,) lie outside the ranges within which a point's predicted error is not above three times that near the
    // calibrated poses. It warns, and changes no command; it is false where the calibration holds everywhere, or does not say where.
    bool beyond(const double* q, int point) const {
        if (point < 0 || point >= static_cast<int>(points.size())) return true;
        const PointData& data = points[point];
        for (std::size_t i = 0; i < data.lower.size(); ++i)
            if (!(q[i] >= data.lower[i] && q[i] <= data.upper[i])) return true;
        return false;
    }
};

class ModelReader {
  public:
    // Null, with a sentence in `error`, where the text is no robot of this version.
    static std::unique_ptr<const Model> read(std::string_view text, std::string& error) {
        Json document;
        if (text.size() > largest_text) return error = "it has more than " + std::to_string(largest_text) + " bytes", nullptr;
        if (!JsonReader(text).read(document, error)) return nullptr;
        ModelReader reader;
        auto model = std::make_unique<Model>();
        if (reader.robot(document, *model)) return model;
        error = reader.error_;
        return nullptr;
    }

  private:
    static constexpr double rounding = 1e-9;

    bool fail(const std::string& problem) {
        if (error_.empty()) error_ = problem;
        return false;
    }

    bool bounded(const char* name, double number, double& value) {
        value = number;
        return std::abs(number) <= largest_number || fail(std::string("'") + name + "' has a number beyond 1e20, which no robot has");
    }

    bool number(const Json& from, const char* name, double& value) {
        const Json* member = from.member(name);
        if (!member || member->kind != Json::Kind::number) return fail(std::string("'") + name + "' is missing or no number");
        return bounded(name, member->number, value);
    }

    // Some programs write their largest number where there is no limit; nothing is multiplied by it.
    bool limit(const Json& from, const char* name, double without, double& value) {
        const Json* member = from.member(name);
        value = member && member->kind == Json::Kind::number ? member->number : without;
        return (member && (member->kind == Json::Kind::null || member->kind == Json::Kind::number)) ||
               fail(std::string("'") + name + "' is missing, or neither a number nor null");
    }

    bool index(const Json& from, const char* name, int least, int below, int& value) {
        double real = 0;
        if (!number(from, name, real)) return false;
        if (!(real >= least && real < below) || real != std::floor(real)) return fail(std::string("'") + name + "' is out of its range");
        value = static_cast<int>(real);
        return true;
    }

    bool text(const Json& from, const char* name, std::string& value) {
        const Json* member = from.member(name);
        if (!member || member->kind != Json::Kind::text) return fail(std::string("'") + name + "' is missing or no text");
        value = member->text;
        return true;
    }

    bool numbers(const Json& from, const char* name, std::size_t count, double* values) {
        const Json* member = from.member(name);
        if (!member || member->kind != Json::Kind::list || member->items.size() != count)
            return fail(std::string("'") + name + "' has not " + std::to_string(count) + " numbers");
        for (std::size_t i = 0; i < count; ++i) {
            if (member->items[i].kind != Json::Kind::number) return fail(std::string("'") + name + "' has something else than numbers");
            if (!bounded(name, member->items[i].number, values[i])) return false;
        }
        return true;
    }

    bool vector(const Json& from, const char* name, Vector3& value) {
        double values[3];
        if (!numbers(from, name, 3, values)) return false;
        value = vector3(values);
        return true;
    }

    bool turn(const Json& from, const char* name, Rotation& value) {
        double values[9];
        if (!numbers(from, name, 9, values)) return false;
        value = rotation(values);
        return (departure_from_rotation(value) < rounding && dot(cross(value.x, value.y), value.z) > 0) || fail(std::string("'") + name + "' is no rotation");
    }

    const std::vector<Json>* list(const Json& from, const char* name) {
        const Json* member = from.member(name);
        if (member && member->kind == Json::Kind::list) return &member->items;
        fail(std::string("'") + name + "' is missing or no list");
        return nullptr;
    }

    bool robot(const Json& document, Model& model) {
        std::string format;
        double version = 0;
        if (document.kind != Json::Kind::object || !text(document, "format", format) || format != "flexcal runtime")
            return error_.clear(), fail("it is no robot of 'flexcal export runtime'");
        if (!number(document, "version", version) || version != 1)
            return error_.clear(), fail("it has another version than 1; export it again, or take the library of that version");
        const Json* tilts_first = document.member("tilts_first");
        if (!tilts_first || tilts_first->kind != Json::Kind::boolean) return fail("'tilts_first' is missing or no boolean");
        model.tree.tilts_first = model.nominal_tree.tilts_first = tilts_first->boolean;
        if (!text(document, "robot", model.robot) || !number(document, "reach", model.reach) || !vector(document, "gravity", model.gravity))
            return false;
        const auto *joints = list(document, "joints"), *points = list(document, "points");
        if (!joints || !points) return false;
        if (model.reach < 0) return fail("'reach' is negative");
        if (joints->empty() || points->empty()) return fail("it has no joint or no point");
        if (joints->size() > most_joints) return fail("it has more than " + std::to_string(most_joints) + " joints");
        for (const Json& each : *joints)
            if (!joint(each, static_cast<int>(joints->size()), model)) return in("joint", model.joints.size() - 1);
        model.prepared = model.tree.prepare(model.geometry.data());
        model.nominal_prepared = model.nominal_tree.prepare(model.nominal_geometry.data());
        for (const Json& each : *points) {
            model.points.emplace_back();
            if (!point(each, model.size(), model.points.back())) return in("point", model.points.size() - 1);
        }
        const auto* couplings = list(document, "couplings");
        if (!couplings) return false;
        for (const Json& each : *couplings) {
            CouplingData data{};
            if (!index(each, "motor", 0, model.size(), data.motor) || !index(each, "joint", 0, model.size(), data.joint) ||
                !number(each, "ratio", data.ratio) || !number(each, "rotor_inertia", data.rotor_inertia) ||
                !number(each, "viscous", data.viscous) || !number(each, "coulomb", data.coulomb))
                return in("coupling", model.couplings.size());
            model.couplings.push_back(data);
        }
        const Json* held = document.member("payload");
        return !held || held->kind == Json::Kind::null || payload(*held, model.size(), model.payload);
    }

    bool in(const char* what, std::size_t place) {
        error_ = std::string(what) + " " + std::to_string(place + 1) + ": " + error_;
        return false;
    }

    bool joint(const Json& from, int count, Model& model) {
        const int i = model.size();
        model.joints.emplace_back();
        JointData& data = model.joints.back();
        const Json* prismatic = from.member("prismatic");
        if (!prismatic || prismatic->kind != Json::Kind::boolean) return fail("'prismatic' is missing or no boolean");
        Joint place{-1, prismatic->boolean, identity(), {}, {}, {}, identity()}, nominal;
        double normals[6], mass = 0, moment[3];
        constexpr double infinite = std::numeric_limits<double>::infinity();
        if (!text(from, "name", data.name) || !index(from, "parent", -1, i, place.parent) || !turn(from, "rotation", place.placement) ||
            !vector(from, "translation", place.translation) || !numbers(from, "normals", 6, normals) || !turn(from, "bearing", place.bearing))
            return false;
        place.normal_1 = vector3(normals), place.normal_2 = vector3(normals + 3);
        for (const Vector3& normal : {place.normal_1, place.normal_2})
            if (!(std::abs(dot(normal, normal) - 1) < rounding)) return fail("'normals' has a vector that is not of unit length");
        nominal = place;
        model.geometry.resize(6 * (i + 1)), model.nominal_geometry.resize(6 * (i + 1));
        if (!vector(from, "nominal_translation", nominal.translation) || !numbers(from, "errors", 6, &model.geometry[6 * i]) ||
            !numbers(from, "nominal_errors", 6, &model.nominal_geometry[6 * i]))
            return false;
        model.tree.joints.push_back(place), model.nominal_tree.joints.push_back(nominal);
        if (!limit(from, "lower", -infinite, data.lower) || !limit(from, "upper", infinite, data.upper) || !number(from, "mass", mass) ||
            !numbers(from, "first_moment", 3, moment) || !number(from, "backlash", data.backlash) ||
            !number(from, "gravity_compliance", data.gravity_compliance) ||
            !numbers(from, "lateral_compliance", 2, data.lateral_compliance))
            return false;
        if (data.lower > data.upper) return fail("'lower' is above 'upper'");
        model.mass.push_back(mass);
        model.first_moment.insert(model.first_moment.end(), moment, moment + 3);
        const Vector3 across[2] = {place.normal_1, place.normal_2};
        Vector3* components[2] = {&data.lateral_1, &data.lateral_2};
        for (int k = 0; k < 2; ++k) *components[k] = {dot(across[k], place.bearing.x), dot(across[k], place.bearing.y), 0};
        model.drives.emplace_back();
        return springs(from, i, model) && transmission(from, i, count, model) && drive(from, model.drives.back());
    }

    bool springs(const Json& from, int i, Model& model) {
        const auto* found = list(from, "springs");
        if (!found) return false;
        int last = -1;
        for (const Json& each : *found) {
            ElasticAxis axis{i, 0};
            double stiffness = 0;
            if (!index(each, "component", 0, 3, axis.component) || !number(each, "stiffness", stiffness)) return false;
            if (!(stiffness > 0)) return fail("a spring has no positive stiffness");
            if (model.tree.joints[i].prismatic) return fail("a prismatic joint has a spring");
            const int place = !model.tree.tilts_first ? 2 - axis.component : axis.component == 2 ? 2 : 1 - axis.component;
            if (place <= last) return fail("its springs do not stand in order from base to tool");
            last = place;
            model.axes.push_back(axis), model.stiffness.push_back(stiffness);
            if (axis.component != 2) continue;
            model.joints[i].drive_stiffness = stiffness;
            if (!number(each, "hardening", model.joints[i].hardening)) return false;
            if (model.joints[i].hardening < 0) return fail("the hardening of a spring is negative");
        }
        return true;
    }

    bool transmission(const Json& from, int i, int count, Model& model) {
        const auto *waves = list(from, "waves"), *ratios = list(from, "ratio_errors");
        if (!waves || !ratios) return false;
        for (const Json& each : *waves) {
            Wave wave{};
            if (!number(each, "order", wave.order) || !number(each, "sin", wave.sine) || !number(each, "cos", wave.cosine)) return false;
            model.joints[i].waves.push_back(wave);
        }
        for (const Json& each : *ratios) {
            RatioError error{i, 0, 0};
            if (!index(each, "joint", 0, count, error.other) || !number(each, "ratio", error.ratio)) return false;
            model.ratio_errors.push_back(error);
        }
        return true;
    }

    bool drive(const Json& from, DriveData& data) {
        const std::pair<const char*, double*> all[] = {
            {"rotor_inertia", &data.rotor_inertia}, {"viscous", &data.viscous}, {"coulomb", &data.coulomb},
            {"torque_offset", &data.torque_offset}, {"coulomb_asymmetry", &data.coulomb_asymmetry},
            {"sublinear_viscous", &data.sublinear_viscous}, {"presliding", &data.presliding}, {"stribeck", &data.stribeck},
            {"load_coulomb", &data.load_coulomb}, {"load_stribeck", &data.load_stribeck}, {"stribeck_velocity", &data.stribeck_velocity},
            {"load_stribeck_velocity", &data.load_stribeck_velocity}, {"spring_stiffness", &data.spring_stiffness},
            {"spring_torque", &data.spring_torque},
        };
        for (const auto& [name, value] : all)
            if (!number(from, name, *value)) return false;
        if (!(data.stribeck_velocity > 0) || !(data.load_stribeck_velocity > 0)) return fail("a Stribeck velocity is not positive");
        return numbers(from, "inertia", 6, data.inertia);
    }

    bool point(const Json& from, int count, PointData& data) {
        return text(from, "name", data.name) && index(from, "joint", 0, count, data.joint) && index(from, "rows", 3, 7, data.rows) &&
               (data.rows == 3 || data.rows == 6 || fail("'rows' is neither 3 nor 6")) &&
               vector(from, "position", data.real.position) && turn(from, "rotation", data.real.rotation) &&
               vector(from, "nominal_position", data.nominal.position) && turn(from, "nominal_rotation", data.nominal.rotation) &&
               holds(from, count, data);
    }

    // Files of earlier exports do not say where the calibration holds.
    bool holds(const Json& from, int count, PointData& data) {
        const Json* member = from.member("holds");
        if (!member || member->kind == Json::Kind::null) return true;
        constexpr double infinite = std::numeric_limits<double>::infinity();
        if (!ends(*member, "lower", count, -infinite, data.lower) || !ends(*member, "upper", count, infinite, data.upper)) return false;
        for (int i = 0; i < count; ++i)
            if (data.lower[i] > data.upper[i]) return fail("'holds' has a lower end above the upper one");
        return true;
    }

    bool ends(const Json& from, const char* name, int count, double without, std::vector<double>& values) {
        const Json* member = from.member(name);
        const bool sized = member && member->kind == Json::Kind::list && member->items.size() == static_cast<std::size_t>(count);
        for (int i = 0; sized && i < count; ++i) {
            const Json& end = member->items[i];
            if (end.kind != Json::Kind::number && end.kind != Json::Kind::null) return fail("'holds' has an end that is neither a number nor null");
            values.push_back(end.kind == Json::Kind::null ? without : end.number);
        }
        return sized || fail(std::string("'holds' has not an end '") + name + "' for every joint");
    }

    bool payload(const Json& from, int count, PayloadData& data) {
        return index(from, "joint", 0, count, data.joint) && vector(from, "com", data.com) && number(from, "mass", data.mass) &&
               number(from, "scale", data.scale) && numbers(from, "inertia", 6, data.inertia);
    }

    std::string error_;
};

// The robot in the text of a file of `flexcal export runtime`; null, with a sentence in `error`, where it cannot be read.
inline std::unique_ptr<const Model> read_model(std::string_view text, std::string& error) { return ModelReader::read(text, error); }

// The same for a regular file.
inline std::unique_ptr<const Model> read_model_file(const std::string& path, std::string& error) {
    std::error_code unknown;
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, unknown)) file.open(path, std::ios::binary);
    std::string text(largest_text + 1, 0);
    if (!file.is_open() || (file.read(text.data(), static_cast<std::streamsize>(text.size())), file.bad())) {
        error = path + " cannot be read";
        return nullptr;
    }
    text.resize(static_cast<std::size_t>(file.gcount()));
    auto model = read_model(text, error);
    if (!model) error = path + ": " + error;
    return model;
}

}  // namespace flexcal::runtime
