"""The same as `drake-disasm monitor`, from a checkout."""

from drake_disasm_cli.main import run

if __name__ == "__main__":
    run("monitor")
