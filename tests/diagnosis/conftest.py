"""Recordings of a perfect instrument, for every test of this room."""

from tests.ideal import flight, ideal_recording, recording_at_rest

__all__ = ["flight", "ideal_recording", "recording_at_rest"]
