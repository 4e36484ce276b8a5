"""Judge a recording from Python: its verdict, its least margin, what the operator was told."""

import numpy as np

import ugv_acceptance as ugv


def main() -> None:
    """Print what was found in the recorded run that ships."""
    result = ugv.evaluate('bags/packbot_fail')
    print(result.verdict, f'{result.coverage:.0%} evaluated')
    for reason in result.reasons:
        print(f'  {reason}')
    margins = result.margins
    least = np.degrees(np.nanmin(margins.tip_angle, axis=0))
    for k, side in enumerate(margins.sides):
        print(f'least tilt left to the {side}: {least[k]:.1f} deg')
    for alert in result.alerts:
        if alert.level == 'ERROR':
            print(f'{alert.start_s:6.2f} s  {alert.message}: {alert.advice}')


if __name__ == '__main__':
    main()
