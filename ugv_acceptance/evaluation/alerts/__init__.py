"""From margins to alerts: the rules, their state machine, the prediction, the words."""
