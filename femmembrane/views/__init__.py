"""Pictures of what was computed: files for ParaView, rendered surfaces and plots."""
