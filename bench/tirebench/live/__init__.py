"""The live chain in processes: one reads the port, one steps the FMU of each wheel, one records.

::

    reader --raw bytes-->  recorder             a process reads from shared memory and writes
           --samples-->    estimator of wheel 1 to shared memory; none waits for another
           --samples-->    estimator of wheel 2
    estimators --turns-->  run (screen, page, JSON), which starts all of them, and starts them again

Only data passes between them: what the bytes mean and what is made of them are
`tirebench.estimator.wheels` and `tirebench.estimator.estimation`, in a replay as well.
"""
