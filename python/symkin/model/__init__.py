# SPDX-License-Identifier: MIT
"""What a mechanism is: chains, poses, settings, kinematics, symmetry, the frames of its file."""
