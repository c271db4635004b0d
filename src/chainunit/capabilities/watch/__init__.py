"""Watch: a load observer beside the motor of a study, or over a recording."""
