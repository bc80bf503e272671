# SPDX-License-Identifier: MIT
"""Files between the stages: mechanisms, plans, measurements and results.

The modules are imported on first use, since they bring in pydantic, pint and pyarrow.
"""
