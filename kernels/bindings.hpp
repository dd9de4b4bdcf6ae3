// Each kernel adds itself to the module.
#pragma once
#include <nanobind/nanobind.h>

void bind_closed_loop(nanobind::module_& m);
void bind_frequency(nanobind::module_& m);
void bind_geared_loop(nanobind::module_& m);
void bind_linear_algebra(nanobind::module_& m);
void bind_runtime(nanobind::module_& m);
void bind_tree(nanobind::module_& m);
void bind_triangle(nanobind::module_& m);
