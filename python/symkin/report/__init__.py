# SPDX-License-Identifier: MIT
"""What results say: one description each, rendered as text and as HTML."""
