# SPDX-License-Identifier: MIT
"""What results say: one page each, rendered as text and as HTML, with its figures.

What tells a kind of result is registered with `symkin.present` where it is written; the module
`pages` has all of them.
"""

from symkin.show import units as units
