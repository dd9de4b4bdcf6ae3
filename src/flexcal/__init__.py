"""flexcal: makes industrial robots accurate."""
