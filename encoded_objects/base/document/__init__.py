"""Files that people write: YAML with the line and column of every key and value.

::

    text       file -> text
    tree       text -> Tree: plain values that remember their places; syntax   what is no YAML
    block      what every block of settings shares; quantity   lengths and angles (pydantic)
    problem    what is wrong, printed as `file:line:column: error: cause`, the line, a caret, a fix
    explain    errors of pydantic at their places

Specs (`generator.spec`) and sensor types (`base.sensor_type_file`) are read by it. A `DocumentKind`
holds the words of their messages, and the error that their packages raise.
"""
