import org.javafmi.proxy.Status;
import org.javafmi.proxy.v2.State;
import org.javafmi.wrapper.v2.Access;

/** By JavaFMI (JNA). */
final class JavaFmi implements Slave {
    private final Access slave;

    JavaFmi(String path) {
        slave = new Access(path);
        ok(slave.setUpExperiment(false, 0.0, 0.0, false, 0.0), "setupExperiment");
    }

    private void ok(Status status, String name) {
        Slave.check(status.getCode() == Status.OK.getCode(), name);
    }

    private int[] reference(String name) {
        return new int[] {slave.getValueReference(name)};
    }

    public void set(String name, double value) {
        ok(slave.setReal(reference(name), new double[] {value}), name);
    }

    public void set(String name, int value) {
        ok(slave.setInteger(reference(name), new int[] {value}), name);
    }

    public void set(String name, boolean value) {
        ok(slave.setBoolean(reference(name), new boolean[] {value}), name);
    }

    public double get(String name) {
        return slave.getReal(slave.getValueReference(name))[0];
    }

    public void enterInitialization() {
        ok(slave.enterInitializationMode(), "enterInitializationMode");
    }

    public void exitInitialization() {
        ok(slave.exitInitializationMode(), "exitInitializationMode");
    }

    public void step(double time, double size) {
        ok(slave.doStep(time, size), "doStep at " + time);
    }

    public void throughBytes() {
        State state = slave.getState(State.newEmptyState());
        byte[] bytes = slave.serializeState(state);
        ok(slave.freeState(state), "freeFMUstate");
        State again = slave.deserializeState(bytes);
        ok(slave.setState(again), "setFMUstate");
        ok(slave.freeState(again), "freeFMUstate");
    }

    public void close() {
        ok(slave.terminate(), "terminate");
        slave.freeInstance();
    }
}
