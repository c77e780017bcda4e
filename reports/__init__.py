"""Reports: a finished loop as one self-contained page, cards for other codes, and the verification of the solver.

Enters: the folder that `close-the-loop` made, or a diagnosis', an audit's. Leaves: HTML, five findings, `.k` cards and
VERIFICATION.md. Imports run down in this order: `figures` (arrays to pictures), `blocks` (what a page is made of) and
`results` (the folder, read), `comparison` (the bird models, their errors and ratings), `sections` (results to blocks),
`explore` (a folder as a page with sliders), `page` (sections to HTML); `template` serves both. `export` and
`verification` stand beside them. Read `page.page` first.
"""
