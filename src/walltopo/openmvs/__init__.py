"""The OpenMVS programs, for the rooms that may use them: where they are, how they are run.

OpenMVS is AGPL-3.0 and no part of walltopo: its programs are run where someone installed them.
"""
