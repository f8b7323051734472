"""Pictures and pages of what was recorded: films, reports, automata, and the live viewer."""
