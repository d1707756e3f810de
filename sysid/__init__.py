"""System identification: measured logs, and what a model of them is missing.

`drake_disasm.logs` is the format in which measurements enter and leave the toolkit
(`docs/reference/log-format.md`).
"""
