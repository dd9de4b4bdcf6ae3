"""Geometric calibration from measured points, its verification and selection of terms."""
