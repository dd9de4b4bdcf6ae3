"""Frequency response matrices with their covariances from recordings."""
