"""The same as `drake-disasm accept`, from a checkout."""

from drake_disasm_cli.main import run

if __name__ == "__main__":
    run("accept")
