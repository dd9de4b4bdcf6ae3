// The compensation of a calibrated robot at run time: C++17, no dependencies, no exceptions, and no allocation once a Solver stands.
//
//   std::string error;
//   const auto model = flexcal::runtime::read_model_file("robot.json", error);  // of `flexcal export runtime`
//   flexcal::runtime::Solver solver(*model);
//   if (solver.compensate(nominal, point, command) == flexcal::runtime::Status::ok) send(command);
#pragma once
#include "flexcal/runtime/model.hpp"
#include "flexcal/runtime/solver.hpp"
