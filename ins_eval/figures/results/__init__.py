"""Every figure of a result by its name: what `.plot()` draws its page shows, made with the functions of `figures`."""
