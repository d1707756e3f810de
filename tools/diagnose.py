"""The same as `drake-disasm diagnose`, from a checkout."""

from drake_disasm_cli.main import run

if __name__ == "__main__":
    run("diagnose")
