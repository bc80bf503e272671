# SPDX-License-Identifier: MIT
"""What speaks against an estimate, and what would explain it: one engine for every question."""
