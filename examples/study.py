# %% [markdown]
# # A study from Python
#
# `Study` does the same as ``chainunit study FILE``. It takes tables with the keys of a study file; texts may have
# units. The example compares the demands on the drive for two crank lengths, with a jam.

# %%
import pandas as pd

from chainunit import Study

study = Study(
    title="A longer crank",
    machine={"r": "150 mm"},
    run={"crank_speed": "20 rev/min", "settle_turns": 1, "turns": 1, "step": "4 ms"},
    event=[{"type": "jam", "side": "left", "force": "2 kN"}],
)
print(study)

# %% [markdown]
# `answers` is a pandas table, `runs` are the time series in xarray.

# %%
results = {r: study.with_values({"machine.r": r}).run() for r in ("150 mm", "170 mm")}
rows = ["crank_torque_peak", "motor_torque_rms", "current_peak"]
print(pd.concat({r: result.answers.loc[rows] for r, result in results.items()}).round(2))
longer = results["170 mm"]
print(longer.verdict)
torque = longer.runs["jam_left"]["machine.rocker.tau"]
print(f"rocker torque in the jam up to {abs(torque).max():.0f} {torque.units}")
