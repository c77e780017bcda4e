"""Fast stand-ins for the solver: the inverse network of the literature and a forward emulator with its own error.

A campaign's Dataset enters; an `InverseNetwork` (curves to parameters) and an `Emulator` (parameters to curves, with
its error) leave. Read emulator, then features, gaussian_process with hyperparameters, run_scatter, validation; then
inverse_network, then network, hidden_size and trainers/; for both scaling, holdout, and files, which saves and loads
them.
"""
