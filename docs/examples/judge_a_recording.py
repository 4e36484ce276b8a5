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
    row, side = np.unravel_index(np.nanargmin(margins.tip_angle), margins.tip_angle.shape)
    least = float(np.degrees(margins.tip_angle[row, side]))
    print(f'least tilt left: {least:.1f} deg to the {margins.sides[side]}')
    for alert in result.alerts:
        if alert.level == 'ERROR':
            print(f'{alert.start_s:6.2f} s  {alert.message}: {alert.advice}')


if __name__ == '__main__':
    main()
