import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="6 Every command and every call", css_file="../notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.cli import app as command_line


@app.cell(hide_code=True)
def title():
    mo.md("""
    # 6 Every command and every call

    One page to keep open. `capture-plan COMMAND --help` and `help(capture_plan.make_plan)` say more.

    ## On the command line
    """)
    return


@app.cell(hide_code=True)
def commands():
    parts.table(("Command", "What it does"), parts.every_command(command_line))
    return


@app.cell(hide_code=True)
def in_python():
    mo.md("""
    ## In Python
    """)
    return


@app.cell(hide_code=True)
def calls():
    parts.table(("Call or record", "What it does"), parts.every_call())
    return


@app.cell(hide_code=True)
def in_settings():
    mo.md("""
    ## In a settings file

    `capture-plan settings -o settings.toml` writes this file; `capture-plan plan RIG --settings settings.toml`
    follows it.
    """)
    return


@app.cell(hide_code=True)
def every_setting():
    parts.printed(parts.settings_file())
    return


if __name__ == "__main__":
    app.run()
