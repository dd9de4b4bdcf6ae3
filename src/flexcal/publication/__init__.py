"""Files that take their places together: all of them or none, whatever ends the program."""

from flexcal.publication.publication import Publication, current
from flexcal.publication.regular import refuse_irregular, refuse_stream
from flexcal.publication.settling import settle

__all__ = ["Publication", "current", "refuse_irregular", "refuse_stream", "settle"]
