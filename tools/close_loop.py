"""The same as `drake-disasm close-loop`, from a checkout."""

from drake_disasm_cli.main import run

if __name__ == "__main__":
    run("close-loop")
