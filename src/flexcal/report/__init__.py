"""Report pages of identification, calibration and design, in HTML."""
