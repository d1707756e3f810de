"""`python -m drake_disasm_cli` is `drake-disasm`."""

from drake_disasm_cli.main import run

if __name__ == "__main__":
    run()
