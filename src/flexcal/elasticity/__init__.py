"""Stiffness and damping of drives and bearings from frequency responses, with their uncertainties."""
