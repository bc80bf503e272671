# SPDX-License-Identifier: MIT
"""What was measured: the columns of tables, measurements, sensors."""
