"""Feed messages one by one, here those of a recording, and hear of every new alert."""

import ugv_acceptance as ugv


def main() -> None:
    """Print the alerts of the recorded run that ships, as they come."""
    live = ugv.LiveEvaluator('packbot')
    known = 0
    for sample in ugv.open_recording('bags/packbot_fail'):
        live.take(sample)
        for alert in live.alerts[known:]:
            print(f'{alert.start_s:6.2f} s  {alert.level} {alert.message}')
        known = len(live.alerts)


if __name__ == '__main__':
    main()
