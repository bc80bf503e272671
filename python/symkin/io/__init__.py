# SPDX-License-Identifier: MIT
"""Files between the stages: mechanisms, plans, measurements and results."""
