"""Where the coupling is stable, predicted from the linear(ised) step and measured with the FMUs.

`linear` has the amplification matrices, `predict` applies them to a scene, `critical` measures critical macro steps.
"""
