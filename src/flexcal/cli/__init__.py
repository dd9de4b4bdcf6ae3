"""The command line: `entry` starts the program, `main` runs a verb; everything that is computed is in `flexcal.jobs`."""
