"""How well the diagnosis does: worlds that conceal effects, scores that know them, runners that ask the tool."""
