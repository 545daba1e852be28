"""What is believed, and how every error that has a name would show beside it.

null           what is believed, through the full mechanization
geometry, drives, propagation   how small errors grow around that solution, and what feeds them
observations   what is compared with it, and how a small error shows there
columns        the response to one sensor error, start error or receiver error
library        the columns of every effect of the vocabulary that a recording may hold
thermometer    noise of a coarse thermometer
"""
