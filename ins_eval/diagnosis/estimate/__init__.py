"""Recordings made ready, their noise, and the sets of effects that explain them."""
