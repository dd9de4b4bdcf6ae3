"""The command line: one module a verb, which parses arguments and prints; everything else is in `flexcal.workflow`."""
