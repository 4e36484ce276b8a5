"""From samples to margins, alerts and a verdict; time comes in with the sample."""
