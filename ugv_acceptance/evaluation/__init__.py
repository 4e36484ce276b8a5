"""From messages to margins, alerts and a verdict, live and recorded by the same rules."""
