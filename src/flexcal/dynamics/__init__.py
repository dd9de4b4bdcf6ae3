"""Identification of dynamic parameters from joint logs: base parameters, friction, payload, drives, estimators with intervals."""
