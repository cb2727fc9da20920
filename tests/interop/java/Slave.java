/** One instance of an FMU in some importer: what Pair needs of it. Statuses other than OK are thrown. */
interface Slave {
    void set(String name, double value);

    void set(String name, int value);

    void set(String name, boolean value);

    double get(String name);

    void enterInitialization();

    void exitInitialization();

    void step(double time, double size);

    /** Saves the state, and gives it to the instance again out of its serialised bytes. */
    void throughBytes();

    void close();

    /** Throws unless the importer reports success. */
    static void check(boolean ok, String what) {
        if (!ok) throw new IllegalStateException(what + " failed");
    }
}
